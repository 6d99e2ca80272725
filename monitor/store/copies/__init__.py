"""What leaves the database as files: tables, workbooks, backups."""
