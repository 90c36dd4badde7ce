"""Where everything lies in the flat buffer: variables, instances, frames, objects, references in initial values."""
