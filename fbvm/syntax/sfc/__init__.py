"""Sequential function charts: their elements, their rules, and the statements that execute them."""
