"""The textbook filter and a loop over pairs of velocities: slow, obvious, independent of the kernels."""

import numpy as np
from scipy import stats


def kalman(mean, covariance, noise, dt, density, z, r):
    """One constant-velocity Kalman step with full matrices; `noise` without process noise (Joseph form)."""
    d = z.size
    eye = np.eye(d)
    f = np.block([[eye, dt * eye], [np.zeros((d, d)), eye]])
    q = density * np.block([[dt**3 / 3 * eye, dt**2 / 2 * eye], [dt**2 / 2 * eye, dt * eye]])
    h = np.hstack([eye, np.zeros((d, d))])
    mean = f @ mean
    covariance = f @ covariance @ f.T + q
    noise = f @ noise @ f.T
    gain = covariance @ h.T @ np.linalg.inv(h @ covariance @ h.T + r)
    keep = np.eye(2 * d) - gain @ h
    return mean + gain @ (z - h @ mean), keep @ covariance, keep @ noise @ keep.T + gain @ r @ gain.T


def class_posterior(changes, tau, jitter, scales, prior, freedom, tempering):
    """Posterior over steadiness classes from velocity changes (M, d) over `tau` s, by scipy's multivariate t."""
    log = np.zeros(len(scales))
    for change in changes:
        for c, scale in enumerate(scales):
            shape = (scale**2 * tau + jitter) * np.eye(len(change))
            log[c] += stats.multivariate_t(shape=shape, df=freedom).logpdf(change)
    log = tempering * log + np.log(prior)
    weights = np.exp(log - log.max())
    return weights / weights.sum()
