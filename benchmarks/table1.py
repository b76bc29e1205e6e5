"""The paper's Table I on recorded drives: representations of motion by the distance of their novel views.

    python benchmarks/table1.py DATASET [--scenes N ...|all] [--cameras front] [--frames A:B:C] [--hold-out N]
                                [--prior NAME] [--weights W] [--representations NAME ...]
                                [--trajectories shift lane-left ...] [--inception FILE] [--i3d FILE]
                                [--quality draft] [--runs DIR] [--json FILE] [--markdown FILE]

For each scene of a data set ``generate`` makes a scene of Gaussians per representation. All of a scene share
frames, looks, geometry, seeds and static fit, and take the same steps. Each is rendered along the novel
trajectories at the recorded times, at the size of the clip, as PNG. ``shift`` stands for two of them,
``--shift-m`` to the left and to the right; underscores may stand for hyphens. ``hybrid-standing`` is hybrid
whose street always stands, as the paper's does; that of hybrid drifts where single frames explain it better.

What is compared: the real set is the recorded pictures of the first camera, those of ``--frames``, brought to
the size of the clip, held-out ones too. The fake set is the renders of one representation, all novel
trajectories together: as many pictures for each trajectory as there are real ones. Of both come features of
every picture (FID, with ``--inception``) and of windows of ``--window`` pictures, one every ``--stride``
(FVD, with ``--i3d``), pooled over scenes. There is no true picture of a shifted view: the distance asks
whether the views look recorded, not whether they are right. Without the two files other networks stand in
for them. Their figures rank rows of one table and cannot be compared with publications.

Beside them: the same of the recorded path itself, where nothing is novel; the floor, which is the distance
of two random halves of the real pictures, ten times, and the distance of a half of the real pictures to a
half of the renders of one trajectory, which alone is comparable with it; kernel distances, which depend less
on how many pictures there are; with ``--hold-out`` PSNR and SSIM of withheld frames, where there is a truth.
The paper states neither how many pictures it took nor their size, nor its trajectories.

Priors that look at a picture get the first recorded one; those that are conditioned on a map get the scene.
Recorded pictures of ``--frames`` are the reference all the same. Layout priors count the frames they make by
``--frames``, too; the others make as many as they do.

What is finished in ``--runs`` is taken where it follows from the same input, options, program and networks.
A scene that cannot be made is named at the end; the table is over the scenes that all rows have.
"""

import sys

from table1.main import main

if __name__ == "__main__":
    sys.exit(main(__doc__))
