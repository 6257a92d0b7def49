"""Prove that the printed bodies fold: the certificate, and two independent looks at it."""
