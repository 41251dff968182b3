"""The text encoder and the two priors that come with the package, and their guides."""
