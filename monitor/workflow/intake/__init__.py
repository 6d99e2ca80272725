"""Campaign folders into the database, and what is there."""
