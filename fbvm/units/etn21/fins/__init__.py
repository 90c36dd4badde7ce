"""The FINS communications service of an ETN21: UDP and TCP on port 9600, nodes, connections, commands of the unit itself."""
