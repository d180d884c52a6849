"""Services of the host machine: files, worker processes, ports, install hints."""
