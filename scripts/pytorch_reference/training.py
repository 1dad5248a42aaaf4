"""A training step: forward, losses, backward, Adam; in one process, or in several that share the batch.

All parameters lie in one flat tensor, and so do their gradients, so that Adam is one fused operation.
"""

import traceback

import torch
import torch.multiprocessing as multiprocessing

from losses import losses

LEARNING_RATE = 1e-4


def flatten(model, weights, gradients):
    """Makes the model's parameters and their gradients views of two flat tensors; the values go along."""
    start = 0
    for parameter in model.parameters():
        end = start + parameter.numel()
        weights[start:end] = parameter.detach().flatten()
        parameter.data = weights[start:end].view_as(parameter)
        parameter.grad = gradients[start:end].view_as(parameter)
        start = end


def adam(weights, gradients):
    parameter = torch.nn.Parameter(weights)
    parameter.grad = gradients
    return torch.optim.Adam([parameter], lr=LEARNING_RATE, fused=True)


def accumulate_gradients(run, window, statistics, gradients):
    """One forward and backward with own predictions fed; gradients are set, not added to."""
    gradients.zero_()
    losses(run(window), window, statistics)["total"].backward()


class OneProcess:
    """Trains with `run`, a callable over `model`'s parameters; products take torch's threads."""

    def __init__(self, model, run):
        count = sum(p.numel() for p in model.parameters())
        self.run, self.statistics = run, model.statistics
        weights, self.gradients = torch.empty(count), torch.zeros(count)
        flatten(model, weights, self.gradients)
        self.optimiser = adam(weights, self.gradients)

    def step(self, window):
        accumulate_gradients(self.run, window, self.statistics, self.gradients)
        self.optimiser.step()


class Shards:
    """Trains in processes of one thread, each with its part of the batch and of the parameters to update.

    `make(rank)` gives a worker its model and the callable over its parameters; every worker must make
    the same weights. Products of one thread on half the batch scale better than threaded products.
    """

    def __init__(self, make, workers=2):
        context = multiprocessing.get_context("spawn")
        self.workers = workers
        self.barrier = context.Barrier(workers + 1)
        self.queues = [context.SimpleQueue() for _ in range(workers)]
        count = sum(p.numel() for p in make(0)[0].parameters())
        self.weights = torch.zeros(count).share_memory_()
        gradients = torch.zeros(workers, count).share_memory_()
        self.processes = [
            context.Process(
                target=work,
                args=(rank, make, self.weights, gradients, self.queues[rank], self.barrier),
                daemon=True,
            )
            for rank in range(workers)
        ]
        for process in self.processes:
            process.start()
        self.barrier.wait()

    def step(self, window):
        for queue, part in zip(self.queues, window.chunk(self.workers, 1)):
            queue.put(part.contiguous())
        self.barrier.wait()  # gradients are there
        self.barrier.wait()  # weights are updated

    def close(self):
        for queue in self.queues:
            queue.put(None)
        for process in self.processes:
            process.join()


def work(rank, make, weights, gradients, queue, barrier):
    try:
        torch.set_num_threads(1)
        model, run = make(rank)
        flatten(model, weights, gradients[rank])
        share = weights.chunk(len(gradients))[rank]
        shares = gradients.chunk(len(gradients), 1)[rank]
        mean = torch.zeros_like(share)
        optimiser = adam(share, mean)
        barrier.wait()
        while (window := queue.get()) is not None:
            accumulate_gradients(run, window, model.statistics, gradients[rank])
            barrier.wait()
            torch.mean(shares, 0, out=mean)
            optimiser.step()
            barrier.wait()
    except Exception:
        traceback.print_exc()
        barrier.abort()
        raise
