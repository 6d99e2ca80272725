-- DuckDB 1.5 loses rows from a secondary index: those that it replays from the write-ahead log after a crash are missing
-- from the index for good once that session ends without having used it, and an equality on the column then misses them.
-- The rows themselves are whole, so dropping the indexes also repairs what was lost from sight. Keys are not affected.
-- What the indexes found is found by the zone maps of the tables, whose rows lie in the order of their campaigns.

DROP INDEX IF EXISTS run_of_campaign;
DROP INDEX IF EXISTS identification_of_campaign;
DROP INDEX IF EXISTS imported_campaign_of_machine;
