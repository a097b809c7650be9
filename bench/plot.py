"""Draws charts with gnuplot, each as SVG and as PNG. The reports of bench/queries and bench/simplify use it."""
import subprocess
import sys


def plot(path, size, body):
    """Runs a script for both terminals."""
    done = []
    for kind, terminal in (("svg", "svg size %d,%d font 'sans,13'" % size), # pixels; points in the other
                           ("png", "pngcairo size %d,%d font 'sans,10' fontscale 2 linewidth 2 pointscale 3" %
                            (2 * size[0], 2 * size[1]))):
        script = [f"set terminal {terminal} background '#ffffff'", f"set output '{path}.{kind}'"] + body
        try:
            subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)
            done.append(f"{path}.{kind}")
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"no chart: {error}", file=sys.stderr)
    print("  ".join(done))


def block(name, points):
    return f"${name} << END\n" + "\n".join(" ".join(map(str, p)) for p in points) + "\nEND"
