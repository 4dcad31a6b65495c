//! Scene text to a tree with spans; pure, never fails; owns Span and Diagnostic.
