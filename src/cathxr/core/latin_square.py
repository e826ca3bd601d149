"""Orders in which every thing stands once in every place and, over all orders, follows every other equally often."""


def williams_orders(count: int) -> tuple[tuple[int, ...], ...]:
    """Return the orders of a Williams design for things 0 to count-1: `count` orders when even, twice as many when odd.

    Every thing stands equally often in every place, and every ordered pair of neighbours comes equally often (once for
    an even count, twice for an odd one), so that carry-over from one to the next is balanced (Williams 1949,
    "Experimental designs balanced for the estimation of residual effects of treatments", Aust. J. Sci. Res. A 2, 149).
    For two: AB and BA.

    Raises:
        ValueError: count is below 1.
    """
    if count < 1:
        raise ValueError(f"count: expected at least 1, got {count}")
    first = [0]
    low, high = 1, count - 1
    while low <= high:
        first.append(low)
        if low < high:
            first.append(high)
        low, high = low + 1, high - 1
    orders = [tuple((each + shift) % count for each in first) for shift in range(count)]
    if count % 2 and count > 1:
        orders += [order[::-1] for order in orders]
    return tuple(orders)
