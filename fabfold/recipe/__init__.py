"""The recipe of a kit: every choice that its bytes depend on."""
