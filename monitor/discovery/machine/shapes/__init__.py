"""The shapes that a scan of a machine tries: of the catalogue, tables, free and flexible ones, gears."""
