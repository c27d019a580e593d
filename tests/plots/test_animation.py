"""The mechanism in motion as a file for slides: frames, bytes that repeat, and what is said without ffmpeg."""

import io
import os
import shutil

import numpy as np
import pytest
from PIL import Image

import cfmkit
from cfmkit.cli import run_command
from cfmkit.families import family
from cfmkit.plots.figures import moving_of
from cfmkit.plots.mechanism_in_motion import FRAME_DURATION, N_FILM_POSES, animation, frames

SPEC = "configs/slider_crank_li2019.yaml"


@pytest.fixture(scope="module")
def solved():
    result = cfmkit.analyze(SPEC)
    return result, moving_of(family(result.spec.family), result)


def test_a_gif_goes_loading_and_unloading_and_repeats_byte_by_byte(solved):
    content = animation(*solved, "gif")
    image = Image.open(io.BytesIO(content))
    assert image.n_frames == 2 * N_FILM_POSES - 2
    assert image.size == (960, 400)
    assert image.info["duration"] == FRAME_DURATION
    assert image.info["loop"] == 0
    assert animation(*solved, "gif") == content


def test_mechanism_and_cursor_move_and_the_rest_stands_still(solved):
    first, *rest = frames(*solved)
    middle = rest[len(rest) // 2]
    changed = (first != middle).any(axis=2)
    assert changed[:, :480].any()
    assert changed[:, 540:].any()
    assert not changed[:, 480:535].any()
    assert np.array_equal(first.shape, (400, 960, 3))


def test_a_film_needs_ffmpeg_and_says_so_before_anything_is_computed(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert run_command(["analyze", SPEC, "--animate", "mp4", "-o", str(tmp_path / "out")]) == 2
    assert "needs the program ffmpeg" in capsys.readouterr().err
    assert not os.path.exists(tmp_path / "out")


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg")
def test_a_film_is_an_mp4(solved):
    content = animation(*solved, "mp4")
    assert content[4:8] == b"ftyp"
    assert len(content) > 10_000


def test_the_option_writes_the_file(tmp_path):
    assert run_command(["analyze", SPEC, "--animate", "gif", "--no-plots", "-o", str(tmp_path / "out"), "-q"]) == 0
    assert sorted(path.name for path in (tmp_path / "out" / "figures").iterdir()) == ["motion.gif"]


def test_a_run_without_poses_says_that_it_has_no_film(tmp_path, capsys):
    lift = ["analyze", "configs/cam_dynamics.yaml", "--animate", "gif", "--no-plots", "-q"]
    assert run_command([*lift, "-o", str(tmp_path / "out")]) == 0
    assert "no film was written" in capsys.readouterr().err
    assert not os.path.exists(tmp_path / "out" / "figures")


def test_a_sensitivity_study_has_a_page_with_indices_and_shares(tmp_path):
    out = tmp_path / "out"
    command = ["sensitivity", "configs/studies/cam_tolerance.yaml", "--samples", "20", "--report", "--no-plots"]
    assert run_command([*command, "-j", "1", "-o", str(out), "-q"]) in (0, 5)
    page = (out / "report.html").read_text()
    assert "a sensitivity study" in page
    assert "yield reached" in page
    assert "yield gain when halved" in page
    assert " src=" not in page.replace('src="data:', "")
