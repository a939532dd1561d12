"""Times scikit-learn and BoTorch on the stored case, one thread, and prints one CSV line a job:
`job,peer,wall_ms_min,cpu_ms_min,quality`. Quality of a fit is its log-likelihood, recomputed here by one formula.

`OMP_NUM_THREADS=1 python peers.py ../../../fixtures/references/sklearn [egobox output]`
scikit-learn 1.9.1, torch 2.15.0, gpytorch 1.15.2, botorch 0.18.1
"""
import sys
import time
import warnings

import numpy as np

warnings.filterwarnings("ignore")
case = sys.argv[1]
train = np.loadtxt(case + "/train.csv", delimiter=",")
x, y = train[:, :-1], train[:, -1]


def likelihood(lengths, noise_ratio):
    """Mean and variance profiled out: the largest likelihood that these length scales and this ratio allow."""
    k = np.exp(-0.5 * (((x[:, None] - x[None]) / lengths) ** 2).sum(-1)) + noise_ratio * np.eye(len(x))
    c = np.linalg.cholesky(k)
    solve = lambda b: np.linalg.solve(c.T, np.linalg.solve(c, b))
    ones = np.ones(len(x))
    mean = ones @ solve(y) / (ones @ solve(ones))
    s2 = (y - mean) @ solve(y - mean) / len(x)
    return -0.5 * len(x) * (np.log(2 * np.pi * s2) + 1) - np.log(np.diag(c)).sum()


def report(job, peer, repeats, work):
    walls, cpus = [], []
    for _ in range(repeats):
        w, c = time.perf_counter(), time.process_time()
        quality = work()
        walls.append(time.perf_counter() - w)
        cpus.append(time.process_time() - c)
    print(f"{job},{peer},{1e3 * min(walls):.4g},{1e3 * min(cpus):.4g},{quality:.6f}", flush=True)


def sklearn_fit():
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    kernel = ConstantKernel(1.0, (1e-3, 1e6)) * RBF(np.full(7, 0.7), (0.02, 20)) + WhiteKernel(1e-4, (1e-10, 1))
    gp = GaussianProcessRegressor(kernel, normalize_y=True, alpha=1e-12).fit(x, y)
    found = gp.kernel_
    return likelihood(found.k1.k2.length_scale, found.k2.noise_level / found.k1.k1.constant_value)


report("fit", "scikit-learn", 3, sklearn_fit)

if len(sys.argv) > 2:
    for line in open(sys.argv[2]):
        if line.startswith("starts,"):
            starts = line.split(",")[1]
            ms, cpu_ms = (float(v) for v in line.split(",")[3:5])
            theta = np.array([float(v) for v in line.split("[")[1].split("]")[0].split(",")])
            std = x.std(0, ddof=1)
            # correlation exp(-(theta·d)²/2) of inputs divided by their standard deviation; its nugget is tiny
            best = max(likelihood(std / theta, g) for g in (1e-12, 1e-11, 1e-10, 1e-9))
            print(f"fit,egobox-gp ({starts} starts),{ms:.4g},{cpu_ms:.4g},{best:.6f}", flush=True)

import torch
from botorch.acquisition import LogExpectedImprovement
from botorch.acquisition.multi_step_lookahead import qMultiStepLookahead
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from botorch.models.transforms import Standardize
from botorch.optim import optimize_acqf
from gpytorch.mlls import ExactMarginalLogLikelihood

torch.set_num_threads(1)
torch.set_default_dtype(torch.double)
X, Y = torch.tensor(x), torch.tensor(-y)[:, None]
model = None


def botorch_fit():
    global model
    model = SingleTaskGP(X, Y, outcome_transform=Standardize(1))
    fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    lengths = model.covar_module.lengthscale.detach().numpy().ravel()
    return likelihood(lengths, model.likelihood.noise.item())


report("fit", "BoTorch", 3, botorch_fit)
cube = torch.stack([torch.zeros(7), torch.ones(7)])


def log_ei():
    criterion = LogExpectedImprovement(model, best_f=Y.max())
    _, value = optimize_acqf(criterion, cube, q=1, num_restarts=10, raw_samples=512)
    return value.item()


def two_step():
    criterion = qMultiStepLookahead(model, batch_sizes=[1], num_fantasies=[8])
    _, value = optimize_acqf(
        criterion, cube, q=criterion.get_augmented_q_batch_size(1), num_restarts=4, raw_samples=64, options={"maxiter": 50}
    )
    return value.item()


report("log-ei", "BoTorch", 3, log_ei)
report("two-step", "BoTorch", 2, two_step)


def composite():
    """One refit of thirty independent outputs and one EI-CF step, at forty observations."""
    from botorch.acquisition.logei import qLogExpectedImprovement
    from botorch.acquisition.objective import GenericMCObjective
    from botorch.sampling import SobolQMCNormalSampler

    r = np.random.default_rng(0)
    a, z = r.normal(size=(7, 30)), torch.tensor(r.random((40, 7)))
    out = torch.sin(z @ torch.tensor(a)) + 0.3 * (z @ torch.tensor(a)) ** 2
    gp = SingleTaskGP(z, (out - out.mean(0)) / out.std(0), train_Yvar=torch.full_like(out, 1e-8), outcome_transform=None)
    fit_gpytorch_mll(ExactMarginalLogLikelihood(gp.likelihood, gp), optimizer_kwargs={"options": {"maxiter": 150}})
    norm = GenericMCObjective(lambda s, X=None: -((s * out.std(0) + out.mean(0)).square().sum(-1) + 1e-30).sqrt())
    best = -out.square().sum(1).sqrt().min()
    criterion = qLogExpectedImprovement(gp, best_f=best, sampler=SobolQMCNormalSampler(torch.Size([64])), objective=norm)
    _, value = optimize_acqf(criterion, cube, q=1, num_restarts=4, raw_samples=128, options={"maxiter": 60, "batch_limit": 4})
    return value.item()


report("composite", "BoTorch EI-CF", 2, composite)
