"""Intake: campaign folders into the database, lists of campaigns and runs, withdrawals."""
