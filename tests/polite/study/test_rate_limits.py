from polite.study.web.protection import LastMinute


def test_no_minute_holds_more_than_the_limit():
    now = [0.0]
    recent = LastMinute(lambda: now[0])
    taken = []
    for tick in range(2000):
        now[0] = 0.25 * tick
        if recent.count("a", 20):
            taken.append(now[0])
    for start in taken:
        assert sum(start <= at < start + 60.0 for at in taken) <= 20
    assert len(taken) >= 20 * (500 // 60)  # and not fewer than are allowed


def test_one_who_is_refused_does_not_hinder_another():
    recent = LastMinute(lambda: 0.0)
    assert [recent.count("a", 2) for _ in range(4)] == [True, True, False, False]
    assert recent.count("b", 2)


def test_those_who_are_gone_are_forgotten():
    now = [0.0]
    recent = LastMinute(lambda: now[0])
    for visitor in range(1000):
        now[0] = float(visitor)
        recent.count(str(visitor), 5)
    assert len(recent._times) <= 121
