"""What all parts of the check share: declarations by name, facts about nodes, and the context of one check."""
