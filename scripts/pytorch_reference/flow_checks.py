"""What the checks of both flows share: a run's weights, an exported batch, the verdict."""

import sys

import torch
from safetensors.torch import load_file

import flow
from checks import compare

TOLERANCES = {torch.float32: 1e-4, torch.float64: 1e-9}
ROUNDING = 1e-17  # of a model's largest gradient
NO_WEIGHTS = ("motion.", "audio.", "target.")  # a run's numbers of its data


def load_batch(path, names):
    batch = load_file(path)
    missing = set(names) - batch.keys()
    if missing:
        raise SystemExit(f"{path}: no entry {', '.join(sorted(missing))}")
    return batch


def load_weights(model, path):
    """In evaluation mode: norms go by the stored statistics, as in an exported batch."""
    saved = {n: v for n, v in load_file(path).items() if not n.startswith(NO_WEIGHTS)}
    try:
        model.load_state_dict(saved)
    except RuntimeError as error:
        raise SystemExit(f"{path}: {error}") from None
    return model.eval()


def log_densities(flowed):
    """log p in nats, [W]."""
    return sum(flow.log_density_parts(flowed).values())


def gradients(model, terms):
    """Losses and gradients by the names of an exported batch."""
    model.zero_grad(set_to_none=True)
    terms["total"].backward()
    found = {f"loss.{name}": term.detach().reshape(1) for name, term in terms.items()}
    # Where no loss sees a parameter, keydance has zeros.
    for name, p in model.named_parameters():
        found[f"gradient.{name}"] = torch.zeros_like(p) if p.grad is None else p.grad.clone()
    return found


def settled(batch, results, tolerance):
    """Without the gradients that are 0 but for rounding, and how many of keydance's are not.

    What is added to the scores of tokens that are all alike, as those of no music, changes nothing.
    """
    of_all = {n: v.abs().max().item() for n, v in results.items() if n.startswith("gradient.")}
    largest = max(of_all.values())
    none = {name for name, value in of_all.items() if value < ROUNDING * largest}
    wrong = [name for name in none if not batch[name].abs().max() <= tolerance * largest]
    for name in wrong:
        print(f"  {name:<31} is not 0 DIFFERS")
    return {n: v for n, v in results.items() if n not in none}, len(wrong)


def verdict(batch, batch_path, found, tolerance):
    """`found`: results in f64 by the version's name; 0 if keydance agrees with each."""
    disagreements = 0
    judged = {name for name in batch if name.startswith(("loss.", "gradient."))}
    for version, results in found.items():
        lone = (results.keys() - batch.keys()) | (judged - results.keys())
        if lone:
            raise SystemExit(f"{batch_path}: not of both: {', '.join(sorted(lone))}")
        results, wrong = settled(batch, results, tolerance)
        names = [name for name in results if not name.startswith("gradient.")]
        title = f"keydance against PyTorch, {version}, f64"
        disagreements += wrong + compare(title, batch, results, tolerance, names)
    if disagreements:
        print(f"\n{disagreements} entries differ by more than {tolerance:g}", file=sys.stderr)
        return 1
    print("\nkeydance agrees with PyTorch")
    return 0
