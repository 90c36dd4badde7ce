"""The runtime of OpenPLC as Modbus clients meet it: its server, and which memory has which number."""
