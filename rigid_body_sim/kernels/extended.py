"""Numbers of twice the precision as sums of two floats (high, low), for the few places where differences lose digits.

Source: Dekker, Numerische Mathematik 18 (1971) 224. Relative error a few 2⁻¹⁰⁴ as long as nothing overflows
(above 1e300) and the low parts do not underflow (below 1e-290).
"""

from .straight_line import straight_line

_SPLITTER = 134217729.0  # 2²⁷ + 1: splits a float into two halves of 26 bits


@straight_line
def two_sum(a: float, b: float) -> tuple[float, float]:
    """a + b as (rounded sum, what rounding dropped), exactly; Knuth, TAOCP vol. 2, 4.2.2."""
    total = a + b
    kept = total - a
    return total, (a - (total - kept)) + (b - kept)


@straight_line
def two_product(a: float, b: float) -> tuple[float, float]:
    """a · b as (rounded product, what rounding dropped), exactly."""
    t = _SPLITTER * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = _SPLITTER * b
    b_high = t - (t - b)
    b_low = b - b_high
    product = a * b
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


@straight_line
def xadd(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Sum of two extended numbers."""
    high, low = two_sum(ah, bh)
    more, rest = two_sum(al, bl)
    high, low = two_sum(high, low + more)
    return two_sum(high, low + rest)


@straight_line
def xmultiply(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Product of two extended numbers."""
    high, low = two_product(ah, bh)
    return two_sum(high, low + (ah * bl + al * bh))


@straight_line
def xdot(
    ah: float,
    al: float,
    bh: float,
    bl: float,
    ch: float,
    cl: float,
    dh: float,
    dl: float,
    eh: float,
    el: float,
    fh: float,
    fl: float,
) -> tuple[float, float]:
    """a b + c d + e f of extended numbers."""
    h, l = xmultiply(ah, al, bh, bl)
    gh, gl = xmultiply(ch, cl, dh, dl)
    h, l = xadd(h, l, gh, gl)
    gh, gl = xmultiply(eh, el, fh, fl)
    return xadd(h, l, gh, gl)


@straight_line
def xrotate_back(
    w: float,
    wl: float,
    x: float,
    xl: float,
    y: float,
    yl: float,
    z: float,
    zl: float,
    a: float,
    al: float,
    b: float,
    bl: float,
    c: float,
    cl: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """|q|² and |q|² Rᵀ v = (w² − u·u) v + 2 (u·v) u − 2 w (u × v) of q = [w, u] and v = (a, b, c), extended numbers."""
    ww, wwl = xmultiply(w, wl, w, wl)
    uu, uul = xdot(x, xl, x, xl, y, yl, y, yl, z, zl, z, zl)
    uv, uvl = xdot(x, xl, a, al, y, yl, b, bl, z, zl, c, cl)
    even, evenl = xadd(ww, wwl, -uu, -uul)
    qq, qql = xadd(ww, wwl, uu, uul)
    uv, uvl, w, wl = 2.0 * uv, 2.0 * uvl, -2.0 * w, -2.0 * wl
    d, dl = xdot(y, yl, c, cl, -z, -zl, b, bl, 0.0, 0.0, 0.0, 0.0)
    e, el = xdot(z, zl, a, al, -x, -xl, c, cl, 0.0, 0.0, 0.0, 0.0)
    f, fl = xdot(x, xl, b, bl, -y, -yl, a, al, 0.0, 0.0, 0.0, 0.0)
    a, al = xdot(even, evenl, a, al, uv, uvl, x, xl, w, wl, d, dl)
    b, bl = xdot(even, evenl, b, bl, uv, uvl, y, yl, w, wl, e, el)
    c, cl = xdot(even, evenl, c, cl, uv, uvl, z, zl, w, wl, f, fl)
    return qq, qql, a, al, b, bl, c, cl


@straight_line
def xunscale(a: float, al: float, qq: float, qql: float) -> tuple[float, float]:
    """a / qq of extended numbers, for qq within some round-off of 1."""
    return two_sum(a, al - a * ((qq - 1.0) + qql))
