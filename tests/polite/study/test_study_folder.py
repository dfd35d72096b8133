def test_a_finished_study_belongs_together(study_folder) -> None:
    study_folder.check()
