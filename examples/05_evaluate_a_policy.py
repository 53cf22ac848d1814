"""A policy that comes with the package, judged over drawn robots: who finishes, who strays, who falls."""

from tracking import TaskConfig, evaluate, evaluation_task, load_bundle

bundle = load_bundle("groove-dancer")
result = evaluate(bundle.runner, bundle.robot, bundle.reference, evaluation_task(TaskConfig()), rollouts=20, seed=1)
print(result)
for name, share in result.outcomes.items():
    low, high = share.interval
    print(f"{name:8} {share.count:3} of {share.of} ({100 * low:.0f} to {100 * high:.0f} %)")
print("hardest second:", result.hardest)
result.save("rollouts.rrd", bundle.robot, bundle.reference)
