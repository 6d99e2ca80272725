"""Reads tables of text, CSV and workbooks as columns of text and of numbers, each message with its line."""
