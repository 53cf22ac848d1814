"""How near a dance's accents are to the beats of its song."""

from __future__ import annotations

from clips import MetricKey
from clips.music import BeatError
from retarget.report.metric import Metric

_MEANING = "from each beat of the song to the dance's nearest accent"


def beat_metrics(danced: BeatError | None, recorded: BeatError | None) -> tuple[Metric, ...]:
    """The rows of a report, at the pace that was found and at the recorded one; none where either has nothing to tell."""
    if danced is None or recorded is None:
        return ()
    share = "beats with an accent within 40 ms"
    return (
        Metric(key=MetricKey.BEAT_ERROR, value=danced.median_ms, unit="ms", meaning=_MEANING),
        Metric(key=MetricKey.BEAT_ERROR_P95, value=danced.p95_ms, unit="ms", meaning=_MEANING),
        Metric(key=MetricKey.ON_BEAT, value=100.0 * danced.on_beat, unit="%", meaning=share),
        Metric(key=MetricKey.BEAT_ERROR_RECORDED, value=recorded.median_ms, unit="ms", meaning=_MEANING),
        Metric(key=MetricKey.ON_BEAT_RECORDED, value=100.0 * recorded.on_beat, unit="%", meaning=share),
    )
