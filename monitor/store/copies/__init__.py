"""What leaves the database as files, and comes back: tables, workbooks, backups (``manifest`` says what each holds)."""
