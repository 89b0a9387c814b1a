"""Base of models that take noise out of images in front of another model of the same run."""

from isarflow.learning.classifier import Classifier, load_classifier
from isarflow.learning.data.features import by_channel, of_peak_one


class Denoised(Classifier):
    """A model that defines `learn` and `denoised`; the model that its setting `of` names, fitted before, does the rest.

    That one learned from images as they are, of which those without noise should pass unchanged.
    """

    learns_noise = True
    combines = True

    def learn(self, images):
        """Learn from training images (n, channel, R, X)."""
        raise NotImplementedError

    def denoised(self, images):
        """Images (n, channel, R, X) without noise, of any level."""
        raise NotImplementedError

    def fit(self, images, labels, validation=None, snrs=None, views=None):
        self.member = load_classifier(self.beside / self.settings["of"])
        self.classes_ = self.member.classes_
        self.learn(by_channel(images))
        return self

    def evaluate(self, images):
        return self.member.evaluate(of_peak_one(self.denoised(by_channel(images)).reshape(images.shape)))

    def load(self, folder):
        self.member = load_classifier(folder.parent / self.settings["of"])
        return super().load(folder)
