"""One module a figure; measured points come from stored results, lines from theory."""
