"""Suites of TcUnit in projects of TwinCAT, as tests of pytest."""
