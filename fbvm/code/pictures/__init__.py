"""What an Image keeps for those who draw a program: charts, and statements of Structured Text as rungs."""
