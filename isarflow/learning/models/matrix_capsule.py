"""Matrix capsules with EM routing and a decoder, by JAX: a class is a pose on which votes agree."""

from pathlib import Path

from isarflow.learning.models.capsule import CODE
from isarflow.learning.models.capsule import Model as CapsuleNetwork
from isarflow.learning.networks import matrix_capsules


class Model(CapsuleNetwork):
    """The capsule network with matrix capsules in place of vectors (Hinton, Sabour and Frosst 2018).

    Primary capsules, a pose of 4 x 4 and an activation each, vote for the classes' capsules by matrices of 4 x 4 that
    all places share; EM routing finds the poses on which votes agree. The paper's two layers of convolutional capsules
    between them are left out: of 32 x 32 pixels the convolutions leave 8 x 8 places. Settings, inputs, decoder and
    training are the capsule network's, with the spread loss in place of the margin loss.
    Scores are the classes' activations. Confidence scores are the capsule network's, but `activation`, that of the
    predicted class, in place of the length; `mixture` is of its pose and activation.
    """

    LABELS = {"matrix_capsule": ("matrix capsule", "the network of matrix capsules", 29)}
    SCORES = {
        "zncc": ("ZNCC", 12),
        "mse": ("MSE", 11),
        "noise_zncc": ("ZNCC, noise taken out", 13),
        "activation": ("class activation", 22),
        "mixture": ("Gaussian mixture", 15),
        "coherence": ("coherence", 16),
    }
    network, code = matrix_capsules, [*CODE, Path(matrix_capsules.__file__), Path(__file__)]
    certainty = "activation"
