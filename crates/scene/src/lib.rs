//! What the user said (Scene), and what is built from it once (World).
