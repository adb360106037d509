"""Circles in a graph of imports."""

from collections.abc import Mapping, Set


def circles(edges: Mapping[str, Set[str]]) -> list[list[str]]:
    """The nodes that reach each other, sorted, the largest circle first: Tarjan's algorithm (1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for target in sorted(edges.get(node, ())):
            if target not in index:
                visit(target)
                low[node] = min(low[node], low[target])
            elif target in stack:
                low[node] = min(low[node], index[target])
        if low[node] == index[node]:
            start = stack.index(node)
            if len(stack) - start > 1:
                found.append(sorted(stack[start:]))
            del stack[start:]

    for node in sorted(edges):
        if node not in index:
            visit(node)
    return sorted(found, key=lambda circle: (-len(circle), circle))


def between(edges: Mapping[str, Set[str]], room: Mapping[str, str]) -> dict[str, set[str]]:
    """The same graph between rooms, each node in its room."""
    result: dict[str, set[str]] = {}
    for node, targets in edges.items():
        result.setdefault(room[node], set()).update(room[target] for target in targets)
    return {name: targets - {name} for name, targets in result.items()}
