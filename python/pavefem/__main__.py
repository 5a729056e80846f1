"""``python -m pavefem`` is the command ``pavefem``."""

from pavefem.cli import app

if __name__ == "__main__":
    app(prog_name="pavefem")
