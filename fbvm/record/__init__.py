"""What is kept of a run, and its renderings: charts, tables, captures."""
