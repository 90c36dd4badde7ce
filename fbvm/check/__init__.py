"""Names, types, constants and rules.  A tree stays a value; facts about its nodes are in side tables (`symbols.facts`).

The folders build on one another: `symbols`, then `expressions`, then `calls`, `declarations` and `lint`; `checker` puts them
together."""
