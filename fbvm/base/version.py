"""The version of fbvm, which recordings and results of campaigns name."""

VERSION = "0.2.0.dev0"
