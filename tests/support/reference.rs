//! Reading of stored reference vectors (`tests/data`).
