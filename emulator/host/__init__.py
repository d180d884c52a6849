"""What the machine gives: files, worker processes, loopback addresses, install hints, text for terminals."""
