#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scores rendered depths against the truth that scene.py wrote.

usage: tests/plain_scene/score_depth.py FOLDER RENDERS

RENDERS is what `semfoam foam_renderer --views test --output_path RENDERS` wrote. Prints, for each
object, the share of its pixels in the held-out views whose depth is within 2 % of the truth, and
the median of the relative errors. Pixels beside the border of an object are left out. Needs
Debian's python3-numpy and python3-opencv.
"""

import glob
import json
import os
import sys

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
import cv2
import numpy as np


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: tests/plain_scene/score_depth.py FOLDER RENDERS")
    folder, renders = sys.argv[1:]
    if not os.path.exists(folder + "/labels.json"):
        sys.exit(folder + "/labels.json: there is no such file; tests/plain_scene/make writes it")
    labels = json.load(open(folder + "/labels.json"))["labels"]
    errors = {name: [] for name in labels.values()}
    paths = sorted(glob.glob(renders + "/depth/*.exr"))
    if not paths:
        sys.exit(renders + "/depth: no .exr files; foam_renderer writes them")
    for path in paths:
        stem = os.path.splitext(os.path.basename(path))[0]
        truth = np.load("%s/depth/%s.npy" % (folder, stem))
        depth = cv2.imread(path, cv2.IMREAD_UNCHANGED)
        if depth.ndim == 3:
            depth = depth[..., -1]
        mask = cv2.imread("%s/object_mask/%s.png" % (folder, stem), cv2.IMREAD_UNCHANGED)
        inside = cv2.erode(mask, np.ones((5, 5))) == cv2.dilate(mask, np.ones((5, 5)))
        for label, name in labels.items():
            here = inside & (mask == int(label))
            errors[name].append((depth[here] - truth[here]) / truth[here])
    for name, parts in errors.items():
        error = np.concatenate(parts)
        print("%-12s %6.1f %% of %7d pixels within 2 %%, median error %+.2f %%" %
              (name, 100 * np.mean(abs(error) < 0.02), len(error), 100 * np.median(error)))


main()
