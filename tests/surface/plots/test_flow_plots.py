"""The history of a flow as a picture."""

import warnings

import pytest

from surface.plots.flow_plots import plot_history


@pytest.mark.parametrize("rows", ["", "0,0.0,nan,5.0,0.9,50.0,40.0\n", "0,0.0,0.0,5.0,0.9,50.0,40.0\n"])
def test_the_history_of_a_flow_that_was_left_before_its_first_step_is_drawn_without_warnings(rows, tmp_path):
    (tmp_path / "run.csv").write_text(f"step,time,tau,energy,reduced_volume,mean_angle,min_angle\n{rows}")
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        plot_history(tmp_path / "run.png", tmp_path / "run.csv")
    assert (tmp_path / "run.png").stat().st_size > 1000
