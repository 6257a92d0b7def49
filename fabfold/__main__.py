"""``python -m fabfold`` is the command ``fabfold``."""

from fabfold.cli.app import main

main()
