"""Services of the machine that runs the emulator: files, worker processes, ports, install hints."""
