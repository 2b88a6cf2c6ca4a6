"""`drake-racket examples`: files to change, and studies that run where they were put."""

from __future__ import annotations

import os
import subprocess
import sys

from tests.conftest import ROOT


def test_files_and_studies(run, run_well, tmp_path):
    out = run_well("examples", str(tmp_path / "mine"))
    directory = tmp_path / "mine"
    assert (directory / "backhand.yaml").is_file()
    assert (directory / "studies" / "sweet_spots" / "__main__.py").is_file()
    assert (directory / "studies" / "first_impact.py").is_file()
    assert not list(directory.rglob("test_*"))
    assert f"wrote {directory / 'tour_low.yaml'}" in out
    (directory / "studies" / "first_impact.py").write_text("mine\n")
    (directory / "tour_low.yaml").unlink()
    status, out, err = run("examples", str(directory))
    assert (status, out) == (2, "")
    assert "of yours" in err
    assert (directory / "studies" / "first_impact.py").read_text() == "mine\n"
    assert not (directory / "tour_low.yaml").exists()  # all or nothing


def test_a_copied_study_runs(run_well, tmp_path):
    run_well("examples", str(tmp_path))
    done = subprocess.run(
        [sys.executable, "-m", "studies.sweet_spots", "--help"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "--quick" in done.stdout


def test_completion_is_on(run_well):
    assert "--install-completion" in run_well("--help")
