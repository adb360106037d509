import numpy as np

from sidestep.thesis.reproduce import projections


def test_cells_hold_mean_and_standard_error_of_their_samples():
    rng = np.random.default_rng(2)
    count = 5_000  # some thirty a cell
    column, row = rng.integers(0, projections.CELLS, (2, count))
    values = rng.exponential(size=count)
    mean, error, fewest = projections._cells(column, row, values)
    assert fewest == min(
        np.sum((column == i) & (row == j)) for i in range(projections.CELLS) for j in range(projections.CELLS)
    )
    for i, j in ((0, 0), (3, 7), (11, 2)):
        inside = values[(column == i) & (row == j)]
        # Means of squares lose a few of the sixteen digits.
        np.testing.assert_allclose(mean[i, j], inside.mean(), rtol=1e-12)
        np.testing.assert_allclose(error[i, j], inside.std() / np.sqrt(len(inside)), rtol=1e-9)
