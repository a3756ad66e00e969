//! GitHub Actions and GitHub Classroom.
