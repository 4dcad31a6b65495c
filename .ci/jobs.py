"""Jobs of `steradian submit` for Kubernetes and OpenCue, without a cluster of either: checked by the schema and by the library that their own
people keep, and then run here, as a kubelet and a render host would start them. Names two jobs: KUBERNETES.yaml OPENCUE.outline.py.
"""

import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

import kubernetes_validate
import outline
import outline.cuerun
import yaml


def kubernetes(path):
    parts, merge = list(yaml.safe_load_all(open(path)))
    for job in (parts, merge):
        kubernetes_validate.validate(job, "1.33", strict=True)
    for job in (parts, merge):
        containers = job["spec"]["template"]["spec"]["containers"]
        (container,) = containers
        for index in range(job["spec"].get("completions", 1)):
            # The working folder is where the volume is mounted: here, this one.
            env = {**os.environ, "JOB_COMPLETION_INDEX": str(index)}
            subprocess.run(container["command"] + container["args"], env=env, check=True)


def opencue(path):
    specs = []

    def keep(job, use_pycuerun=True, **options):
        specs.append(outline.cuerun.OutlineLauncher(job, **options).serialize(use_pycuerun))

    outline.cuerun.launch = keep
    exec(compile(open(path).read(), path, "exec"), {})
    (spec,) = map(xml.fromstring, specs)
    (depend,) = spec.find("depends")
    assert (depend.findtext("deplayer"), depend.findtext("onlayer")) == ("merge", "parts"), "the merge waits for the parts"
    for layer in spec.find("job").find("layers"):
        first, _, last = layer.findtext("range").partition("-")
        for frame in range(int(first), int(last or first) + 1):
            # A host writes the command to a file and runs that, somewhere else.
            with tempfile.TemporaryDirectory() as elsewhere:
                command = layer.findtext("cmd").replace("#IFRAME#", str(frame))
                file = os.path.join(elsewhere, "command")
                with open(file, "w") as f:
                    f.write("#!/bin/sh\n" + command + "\n")
                subprocess.run(["sh", file], cwd=elsewhere, check=True)


kubernetes(sys.argv[1])
opencue(sys.argv[2])
