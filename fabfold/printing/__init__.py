"""Printer profiles, and checks of the printed bodies against them.

:func:`fabfold.printing.profiles.load_profile` gives the limits of a printer and material, and
:func:`fabfold.printing.body_checks.check_bodies` holds the bodies against them: topology, gaps,
walls, sizes and overhangs, each in a module of its own. ``profile_coupon`` writes a tolerance
coupon, and ``calibrate`` makes a profile of what is read off the printed coupon.
"""
