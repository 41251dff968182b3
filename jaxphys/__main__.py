"""`python -m jaxphys`."""

from jaxphys.cli.main import main

main()
