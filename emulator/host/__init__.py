"""The machine that the emulator runs on: files, worker processes, local ports, install hints."""
