"""The Cortex-M4 core: instructions (Unicorn), exceptions, system control space, exact virtual time."""
