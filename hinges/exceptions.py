"""The exceptions of the hinge library.

.. code-block:: text

    ValueError
    └── HingeError        a parameter is wrong, or a construction failed
        └── FitError      a geometry that cannot be printed or cannot turn; names the rule
    ImportError
    └── KernelError       the CAD kernel's Python packages are broken or missing
"""

from __future__ import annotations

__all__ = ["FitError", "HingeError", "KernelError"]


class HingeError(ValueError):
    """A parameter is wrong, or a construction gave no valid solid."""


class FitError(HingeError):
    """A hinge that cannot be printed or cannot turn.

    Attributes
    ----------
    rule : str
        Name of the rule, as listed in ``hinges.fit.RULES``.
    value, limit : float
        What the parameters give and what the rule asks for, in `unit`.
    unit : str
        Unit of both: "mm", "°", "%" or "" for counts.
    advice : str
        What to change.
    """

    def __init__(
        self, rule: str, what: str, value: float, limit: float, advice: str, unit: str = "mm"
    ) -> None:
        self.rule = rule
        self.value = value
        self.limit = limit
        self.unit = unit
        self.advice = advice
        self._what = what
        space = f" {unit}" if unit else ""
        super().__init__(
            f"{rule}: {what} is {value:.3g}{space}, limit {limit:.3g}{space}; {advice}"
        )

    def __reduce__(self) -> tuple[type[FitError], tuple[str, str, float, float, str, str]]:
        """Pickle by the arguments, so that the error crosses process borders."""
        return (
            FitError,
            (self.rule, self._what, self.value, self.limit, self.advice, self.unit),
        )


class KernelError(ImportError):
    """The CAD kernel's Python packages are broken or missing."""
