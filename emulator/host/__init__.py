"""The emulator's machine: files, worker processes, ports, install hints."""
