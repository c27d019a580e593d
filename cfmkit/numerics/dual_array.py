"""Arrays with their derivatives by k variables (dual numbers): what is computed with them has exact derivatives.

Values and derivatives are real, so that they take a fraction of the time of a complex step in every variable.

Reference
---------
[GW] A. Griewank, A. Walther, Evaluating Derivatives (2008), ch. 3: the forward mode.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

COMPLEX_STEP = 1e-30  # nothing is subtracted, so that its square may vanish beside one


class DualArray:
    """An array (...) and its derivatives (k, ...) by k variables, of length 1 where they are one along an axis.

    Examples
    --------
    >>> x = DualArray(np.array([3.0]), np.eye(1))
    >>> (x * x / (1 + x)).slopes
    array([[0.9375]])
    """

    __slots__ = ("slopes", "value")
    __array_ufunc__ = None  # arrays leave operators to this class

    def __init__(self, value: Any, slopes: Any) -> None:
        self.value, self.slopes = value, slopes

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return tuple(self.value.shape)

    @property
    def ndim(self) -> int:
        """Number of its axes."""
        return int(self.value.ndim)

    @property
    def all_slopes(self) -> Any:
        """All derivatives, (k, ...); a view."""
        if self.slopes.shape[1:] == self.value.shape:
            return self.slopes
        return np.broadcast_to(self.slopes, (len(self.slopes), *self.value.shape))

    def aligned_slopes(self, ndim: int) -> Any:
        """Return the derivatives with as many axes as an array of `ndim`, and that of the variables."""
        missing = ndim - self.value.ndim
        return (
            self.slopes
            if missing <= 0
            else self.slopes.reshape(len(self.slopes), *(1,) * missing, *self.slopes.shape[1:])
        )

    def __neg__(self) -> DualArray:
        return DualArray(-self.value, -self.slopes)

    def __add__(self, operand: Any) -> DualArray:
        if not isinstance(operand, DualArray):
            value = self.value + operand
            return DualArray(value, self.aligned_slopes(value.ndim))
        value = self.value + operand.value
        return DualArray(value, self.aligned_slopes(value.ndim) + operand.aligned_slopes(value.ndim))

    __radd__ = __add__

    def __sub__(self, operand: Any) -> DualArray:
        return self.__add__(-operand)

    def __rsub__(self, operand: Any) -> DualArray:
        return (-self).__add__(operand)

    def __mul__(self, operand: Any) -> DualArray:
        if not isinstance(operand, DualArray):
            value = self.value * operand
            return DualArray(value, self.aligned_slopes(value.ndim) * operand)
        value = self.value * operand.value
        slopes, others = self.aligned_slopes(value.ndim), operand.aligned_slopes(value.ndim)
        return DualArray(value, slopes * operand.value + others * self.value)

    __rmul__ = __mul__

    def __truediv__(self, operand: Any) -> DualArray:
        if not isinstance(operand, DualArray):
            value = self.value / operand
            return DualArray(value, self.aligned_slopes(value.ndim) / operand)
        value = self.value / operand.value
        slopes, others = self.aligned_slopes(value.ndim), operand.aligned_slopes(value.ndim)
        return DualArray(value, (slopes - others * value) / operand.value)

    def __rtruediv__(self, operand: Any) -> DualArray:
        value = operand / self.value
        return DualArray(value, -self.aligned_slopes(value.ndim) * (value / self.value))

    def __pow__(self, exponent: int) -> DualArray:
        return DualArray(self.value**exponent, self.slopes * (exponent * self.value ** (exponent - 1)))

    def __matmul__(self, matrix: Any) -> DualArray:
        """Return the products of rows with a matrix of numbers."""
        return self.map_linear(lambda rows: rows @ matrix)

    def __getitem__(self, index: Any) -> DualArray:
        places = index if isinstance(index, tuple) else (index,)
        return DualArray(self.value[places], self.all_slopes[(slice(None), *places)])

    def sum(self, axis: int) -> DualArray:
        """Return the sum along an axis, which is counted from the end."""
        return self.map_linear(lambda rows: rows.sum(axis=axis))

    def map_linear(self, function: Callable[[Any], Any]) -> DualArray:
        """Return a linear function of the last axes of the array."""
        last = self.slopes
        if last.shape[-1] != self.value.shape[-1]:
            last = np.broadcast_to(last, (*last.shape[:-1], self.value.shape[-1]))
        return DualArray(function(self.value), function(last))


def cos_sin(angle: Any) -> tuple[Any, Any]:
    """Return cosine and sine of angles: real, dual or with complex steps, whose squares vanish.

    Examples
    --------
    >>> cos, sin = cos_sin(np.array([0.5 + 1e-30j]))
    >>> (cos.imag / 1e-30).round(9).tolist(), (sin.imag / 1e-30).round(9).tolist()
    ([-0.479425539], [0.877582562])
    """
    if isinstance(angle, DualArray):
        cos, sin = np.cos(angle.value), np.sin(angle.value)
        return DualArray(cos, -sin * angle.slopes), DualArray(sin, cos * angle.slopes)
    if not np.iscomplexobj(angle):
        return np.cos(angle), np.sin(angle)
    cos, sin = np.cos(angle.real), np.sin(angle.real)  # those of complex numbers take seven times as long
    return cos - 1j * (sin * angle.imag), sin + 1j * (cos * angle.imag)


def stack(parts: Sequence[Any]) -> Any:
    """Return arrays as the last axis of one."""
    dual = next((part for part in parts if isinstance(part, DualArray)), None)
    if dual is None:  # as np.stack does, in a third of the time
        stacked = np.empty((*np.shape(parts[0]), len(parts)), np.result_type(*parts))
        for k, part in enumerate(parts):
            stacked[..., k] = part
        return stacked
    values = [part.value if isinstance(part, DualArray) else part for part in parts]
    value = np.stack(np.broadcast_arrays(*values), axis=-1)
    slopes = [part.aligned_slopes(value.ndim - 1) if isinstance(part, DualArray) else 0.0 for part in parts]
    shape = np.broadcast_shapes(*(np.shape(slope) for slope in slopes))
    return DualArray(value, np.stack([np.broadcast_to(slope, shape) for slope in slopes], axis=-1))


def plain(x: Any) -> Any:
    """Return the values of an array, dual or not."""
    return x.value if isinstance(x, DualArray) else x


def dual_of_steps(value: Any, stepped: Any) -> Any:
    """Return an array (...) with its derivatives from complex steps (k, ...); the array if all of them are zero."""
    slopes = np.imag(stepped) / COMPLEX_STEP
    return DualArray(value, slopes) if slopes.any() else value


def chain(
    value: Any,  # (...): of the function
    # partials, arguments: derivatives of the function by its arguments, (...) each, and these arguments
    partials: Sequence[Any],
    arguments: Sequence[Any],
) -> Any:
    """Return a function's values with their derivatives, from its partial derivatives; the values if none is dual.

    Examples
    --------
    >>> x = DualArray(np.array([3.0]), np.eye(1))
    >>> chain(x.value**2, [2 * x.value], [x]).slopes
    array([[6.]])
    """
    slopes = [
        argument.aligned_slopes(np.ndim(value)) * partial
        for partial, argument in zip(partials, arguments, strict=True)
        if isinstance(argument, DualArray)
    ]
    return DualArray(value, sum(slopes[1:], slopes[0])) if slopes else value


def map_analytic(function: Callable[[Any], tuple[Any, ...]], x: DualArray) -> tuple[DualArray, ...]:
    """Return some analytic functions of every number of an array, by complex steps."""
    stepped = function(x.value + 1j * COMPLEX_STEP * x.slopes)
    return tuple(
        DualArray(plain, part.imag / COMPLEX_STEP) for plain, part in zip(function(x.value), stepped, strict=True)
    )


def slopes_of(x: Any, count: int, shape: tuple[int, ...]) -> Any:
    """Return the derivatives (count, *shape) of an array, which are zero unless it is dual."""
    slopes = x.aligned_slopes(len(shape)) if isinstance(x, DualArray) else 0.0
    return np.broadcast_to(slopes, (count, *shape))
