"""Many simulated participants of a web study at once; see assets/results/study_load."""

from study_load import make_study, measure

TARGET = 200.0
"""Of the 95th percentile of an answer with 200 participants [ms]."""


def test_an_answer_is_quick_with_200_participants(benchmark, tmp_path):
    folder = make_study(tmp_path / "study")
    given = {"workers": 1, "levels": (200,)}
    (row,) = benchmark.pedantic(
        measure, (folder, f"sqlite:///{tmp_path}/study.db"), given, rounds=1
    )
    benchmark.extra_info.update(row)
    assert not row["errors"]
    assert row["p95_ms"] < TARGET
