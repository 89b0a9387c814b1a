"""What the page's words mean: shown where a reader points at one, and listed at its end."""

# A term as it stands in a text, or several in which it does, and what it means in a sentence or two.
GLOSSARY = {
    "weighted F1": "Of each class the harmonic mean of precision and recall, averaged with the classes' numbers of "
    "images as weights. 1 is perfect.",
    "open set": "Test images of known targets and of unknown ones, which no model has seen and each shall reject.",
    "closed set": "Test images of the known targets alone.",
    "by sector": "An arc of the aspects tests, at least an aperture away from all that trains; the arcs take turns.",
    "by elevation": "Every second elevation trains, and the test images are of those between: views that lie between "
    "a library's.",
    "at random": "Single aspects are drawn to be tested: each has neighbours among the training images that share most "
    "of its samples.",
    "blind": "A threshold of rejection chosen without any image of an unknown target.",
    "thesis thresholds": "Thresholds of rejection chosen with images of the unknown targets at validation views, as "
    "the reference thesis does.",
    "kept thresholds": "Thresholds of rejection that keep a share of the known images, 95 % unless the config says "
    "another, chosen by these alone: validation images, or at random a library's views left out in turn.",
    "validation images": "Images of views that neither train nor test: thresholds and settings are chosen by them.",
    "ZNCC": "Zero-mean normalised cross-correlation of two images: 1 where they are alike but for brightness, 0 where "
    "nothing of them is.",
    "MSE": "Mean squared error between an image and its reconstruction.",
    "AUROC": "The probability that an image of a known target has a higher confidence score than one of an unknown "
    "target; 0.5 is chance.",
    "FPR at 95 % TPR": "False positive rate at a true positive rate of 95 %: the share of unknown images that are kept "
    "by the threshold that keeps 95 % of the known ones.",
    "OSCR": "Open-set classification rate: area under the rate of correct classification against that of unknown "
    "images taken for known.",
    "confidence score": "How much an image is like the known classes to a model: larger is more, and what is below a "
    "threshold is rejected.",
    "softmax": "As a confidence score the largest probability that a model gives a known class.",
    "maximum logit": "As a confidence score the largest output for a known class before the softmax.",
    "energy": "As a confidence score the logarithm of the sum of exp(logit) over the known classes.",
    "Mahalanobis": "As a confidence score minus the distance of a network's hidden units to the nearest class's mean, "
    "in units of their scatter.",
    "capsule length": "As a confidence score the length of the longest activation vector.",
    "Gaussian mixture": "As a confidence score the density of the predicted class's activation vector under a mixture "
    "of Gaussians fitted to that class.",
    "coherence": "The magnitude of a normalised complex correlation: 1 where two images are alike but for a factor.",
    "noise taken out": "The noise's power, estimated from the image, is taken out of the variance that ZNCC is "
    "divided by.",
    "nearest distance": "As a confidence score minus the distance to the nearest training image.",
    "5th nearest neighbour": "As a confidence score minus the distance of a network's hidden units to the 5th nearest "
    "of the training images.",
    "margin": "As a confidence score the signed distance from the separating surface of a known class, in margins.",
    "relative Mahalanobis": "The Mahalanobis score, less the same of all training images together.",
    "SVM": "Support vector machine, with a Gaussian kernel.",
    "KNN": "K nearest neighbours, which vote.",
    "FCNN": "Fully connected neural network.",
    "LR": "Logistic regression.",
    "OpenMax": "A softmax with a class 'unknown' besides, from how far an image's logits lie from its class's mean.",
    "peak_3db": "Signal power is the mean over the aperture's samples within 3 dB of its strongest.",
    "mean power": "Signal power is the mean over all samples of the aperture.",
    "SNR": "Signal-to-noise ratio of the samples before the image is formed, in decibels.",
    "95 % intervals": "From resampling blocks of test images that belong together: arcs of an aperture, or by sector "
    "the folds.",
    "coherent": "With phase: magnitudes alone are incoherent.",
    "adaptive matched filter": "Correlation with training images after the covariance of all images at that SNR has "
    "been made white.",
    "adaptive filter": "Correlation with training images after the covariance of all images at that SNR has been made "
    "white.",
    "matched filter": "The class of the training image with the largest complex correlation.",
    "capsule network": "A network whose output for a class is a vector; its length says how sure it is, and a decoder "
    "makes the image anew from it.",
    "ISAR": "Inverse synthetic aperture radar: an image in range and cross-range of a target that turns.",
    "cross-range": "The direction at right angles to the line of sight in the plane of the turn.",
    "unambiguous": "What lies farther out than the sampling allows appears on the other side of the image.",
    "RCS": "Radar cross section, 4π|f|² of the scattering amplitude f.",
    "dBsm": "Decibels over one square metre.",
    "residual": "How far the solved currents miss the equations, relative to their right-hand side.",
    "unknowns": "Edges of the mesh that carry a current to be solved for.",
    "Mie": "The exact solution for a sphere, as a series.",
    "method of moments": "Surface currents in basis functions on a mesh, found from a linear system.",
    "EFIE": "Electric field integral equation.",
    "CFIE": "Combined field integral equation, for closed targets; it has no interior resonances.",
    "aperture": "The aspects whose echoes together make one image.",
    "folds": "By sector: which arcs test and which train; by elevation: which of the elevations between test. A model "
    "is fitted to each fold.",
    "realizations": "Draws of the noise that are added to the same echoes.",
    "range profile": "Echo against range at one aspect, from all frequencies together.",
    "sinogram": "Range profiles side by side over azimuth: each scatterer draws a sine.",
    "validation mean": "Mean weighted F1 over the middle SNRs on the validation images, by which methods are ranked.",
}
