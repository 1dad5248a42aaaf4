"""A training step: forward, losses, backward, Adam; in one process, or in several that share the batch.

Every gradient is taken as autograd leaves it: nothing is set to 0, added up or copied but what another
process has to see.
"""

import traceback

import torch
import torch.multiprocessing as multiprocessing

LEARNING_RATE = 1e-4
BETAS = (0.9, 0.999)
EPSILON = 1e-8


def views(model, flat):
    """Parts of a flat tensor in the shapes of the model's parameters."""
    sizes = [parameter.numel() for parameter in model.parameters()]
    return [v.view_as(p) for v, p in zip(flat.split(sizes), model.parameters())]


class OneProcess:
    """Trains with `loss`, a function of a batch over `model`'s parameters; products take torch's threads."""

    def __init__(self, model, loss):
        self.loss = loss
        self.optimiser = torch.optim.Adam(model.parameters(), lr=LEARNING_RATE, fused=True)

    def step(self, batch):
        self.optimiser.zero_grad(set_to_none=True)
        self.loss(batch).backward()
        self.optimiser.step()


class Shards:
    """Trains in processes of one thread, each with its part of the batch and of the parameters to update.

    `make(rank)` gives a worker its model and the loss over its parameters; every worker must make the
    same weights. `split(batch, workers)` cuts a batch into parts of one size. Products of one thread on
    half the batch scale better than threaded products.
    """

    def __init__(self, make, split, workers=2, fuse=False):
        context = multiprocessing.get_context("spawn")
        self.workers, self.split = workers, split
        self.barrier = context.Barrier(workers + 1)
        self.queues = [context.SimpleQueue() for _ in range(workers)]
        count = sum(p.numel() for p in make(0)[0].parameters())
        self.weights = torch.zeros(count).share_memory_()
        gradients = torch.zeros(workers, count).share_memory_()
        self.processes = [
            context.Process(
                target=work,
                args=(rank, make, fuse, self.weights, gradients, self.queues[rank], self.barrier),
                daemon=True,
            )
            for rank in range(workers)
        ]
        for process in self.processes:
            process.start()
        self.barrier.wait()

    def step(self, batch):
        for queue, part in zip(self.queues, self.split(batch, self.workers)):
            queue.put(part)
        self.barrier.wait()  # gradients are there
        self.barrier.wait()  # weights are updated

    def close(self):
        for queue in self.queues:
            queue.put(None)
        for process in self.processes:
            process.join()


def update(weights, gradients, first, second, rate, divisor):
    """Adam on the mean of the processes' gradients, in one pass over memory where it is compiled."""
    mean = gradients.mean(0)
    first.lerp_(mean, 1 - BETAS[0])
    second.mul_(BETAS[1]).addcmul_(mean, mean, value=1 - BETAS[1])
    weights.sub_(rate * first / (second.sqrt() * divisor + EPSILON))


def work(rank, make, fuse, weights, gradients, queue, barrier):
    try:
        torch.set_num_threads(1)
        model, loss = make(rank)
        for view, parameter in zip(views(model, weights), model.parameters()):
            view.copy_(parameter.detach())
            parameter.data = view
        for view, parameter in zip(views(model, gradients[rank]), model.parameters()):
            parameter.register_post_accumulate_grad_hook(hand_over(view))
        share = weights.chunk(len(gradients))[rank]
        shares = gradients.chunk(len(gradients), 1)[rank]
        first, second = torch.zeros_like(share), torch.zeros_like(share)
        move = torch.compile(update, dynamic=False) if fuse else update
        steps = 0
        barrier.wait()
        while (batch := queue.get()) is not None:
            loss(batch).backward()
            barrier.wait()
            steps += 1
            corrections = [1 - beta**steps for beta in BETAS]
            rate = torch.tensor(LEARNING_RATE / corrections[0])
            with torch.no_grad():
                move(share, shares, first, second, rate, torch.tensor(corrections[1] ** -0.5))
            barrier.wait()
    except Exception:
        traceback.print_exc()
        barrier.abort()
        raise


def hand_over(view):
    """While it is in the caches: each gradient to where the other processes read it."""

    def hook(parameter):
        view.copy_(parameter.grad)
        parameter.grad = None

    return hook
