"""Auditing a run, between two events: everything that must hold, looked at slowly and from scratch."""

from __future__ import annotations

from kinetile.run.audit.audit import Complaint, check_all, complaints

__all__ = ["Complaint", "check_all", "complaints"]
