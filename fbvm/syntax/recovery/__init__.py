"""What happens at a syntax error: the message, the repair, and where reading goes on."""
