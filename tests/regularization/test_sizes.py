"""The volumes that cells are to have."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate


def volumes(points, cells):
    return hc.quality((points, cells)).volume


def test_cells_resist_losing_and_gaining_volume_unless_their_sizes_are_free():
    # Rings of a ball are of very different thickness: regular cells would be of another size.
    points, cells = generate.jittered(*generate.ball(4, 2), 0.35, seed=1)
    ratios = {}
    for sizes in ("input", "free"):
        result = hc.regularize((points, cells), sizes=sizes)
        ratio = volumes(result.points, cells) / volumes(points, cells)
        ratios[sizes] = np.abs(np.log(ratio)).max()
        told = result.report.size_ratios
        assert told is None if sizes == "free" else told == pytest.approx((ratio.min(), ratio.max()))
        assert ("times their targets" in str(result.report)) == (sizes == "input")
        assert result.report.after.invalid == 0
    assert ratios["input"] < 0.8 * ratios["free"]


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_wanted_volumes_are_approached_in_every_unit(unit):
    points, cells = generate.box((6, 6, 6))
    wanted = np.where(points[cells].mean(axis=1)[:, 0] < 0.5, 0.5, 1.5) / 216.0
    result = hc.regularize((unit * points, cells), sizes=unit**3 * wanted)
    assert result.report.after.invalid == 0
    ratio = volumes(result.points, cells) / (unit**3 * wanted)
    assert result.report.size_ratios == pytest.approx((ratio.min(), ratio.max()))
    # They come in at 2/3 and 2; beside what is wanted there is the shape to pay for.
    assert 0.9 < ratio.min() < ratio.max() < 1.2
    mesh = hc.HexMesh(unit * points, cells, cell_data={"wanted": unit**3 * wanted})
    assert np.array_equal(hc.regularize(mesh, sizes="wanted").points, result.points)


def test_inverted_cells_have_no_size():
    points, cells = generate.jittered(*generate.ball(4, 2), 0.9, seed=1, valid=False)
    valid = hc.quality((points, cells)).valid
    assert 0 < valid.sum() < len(cells) - 10
    result = hc.regularize((points, cells))
    ratio = (volumes(result.points, cells) / volumes(points, cells))[valid]
    assert result.report.after.invalid == 0
    assert result.report.size_ratios == pytest.approx((ratio.min(), ratio.max()))


def test_the_distortion_alone_does_not_feel_sizes():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.3, seed=1)
    for options in ({"energy": "quaternionic", "boundary": "fixed"}, {"emphasis": "mean", "boundary": "fixed"}):
        one, other = (hc.regularize((points, cells), sizes=sizes, **options).points for sizes in ("input", "free"))
        assert np.array_equal(one, other)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ("large", "'input', 'free' or a cell array, not 'large'; there are: none"),
        (np.ones(3), "one volume for each of the 8 cells"),
        (np.arange(8.0), "finite and positive; those of cells 1 \\(ids 0"),
        (np.full(8, np.nan), "finite and positive"),
        ({"a": 1}, "'input', 'free', a cell array"),
    ],
)
def test_sizes_that_make_no_sense_are_refused(sizes, words):
    with pytest.raises(hc.OptionError, match=words):
        hc.regularize(generate.box((2, 2, 2)), sizes=sizes)
    with pytest.raises(hc.OptionError, match="sizes that cells should get must go with energy='barrier'"):
        hc.Options(sizes=sizes, energy="quaternionic")
