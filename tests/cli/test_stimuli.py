import json


def test_a_set_is_made_and_made_again(run, tmp_path):
    (tmp_path / "set.toml").write_text("seconds = 0.2\nwidth = 64\nheight = 64\n[[displays]]\nview = 45\n")
    done = run("stimuli", "set.toml", "--out", "one")
    assert "1 stimuli of 12 frames" in done.out
    run("stimuli", "one/stimuli.json", "--out", "two")
    told = [json.loads((tmp_path / name / "stimuli.json").read_text()) for name in ("one", "two")]
    assert told[0] == told[1]
    again = run("stimuli", "set.toml", "--out", "one")
    assert again.code == 2
    assert "new or an empty folder" in again.err
