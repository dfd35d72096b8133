"""The first tables.

Revision ID: 0001
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    """Make them."""
    op.create_table(
        "designs",
        sa.Column("sha", sa.String(length=64), nullable=False),
        sa.Column("content", sa.Text(), nullable=False),
        sa.Column("first_used", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("sha"),
    )
    op.create_table(
        "invitations",
        sa.Column("token", sa.String(length=64), nullable=False),
        sa.Column("cap", sa.Integer(), nullable=False),
        sa.Column("withdrawn", sa.Integer(), nullable=False),
        sa.Column("created", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("token"),
    )
    op.create_table(
        "withdrawals",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("condition", sa.String(length=16), nullable=False),
        sa.Column("stage", sa.String(length=16), nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("id"),
    )
    op.create_table(
        "participants",
        sa.Column("number", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("session", sa.String(length=64), nullable=False),
        sa.Column("code", sa.String(length=32), nullable=False),
        sa.Column("invitation", sa.String(length=64), nullable=False),
        sa.Column("condition", sa.String(length=16), nullable=False),
        sa.Column("block", sa.Integer(), nullable=False),
        sa.Column("design", sa.String(length=64), nullable=False),
        sa.Column("consent_version", sa.Text(), nullable=False),
        sa.Column("stage", sa.String(length=16), nullable=False),
        sa.Column("joined_at", sa.Double(), nullable=False),
        sa.Column("last_seen", sa.Double(), nullable=False),
        sa.Column("finished_at", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["design"],
            ["designs.sha"],
        ),
        sa.ForeignKeyConstraint(
            ["invitation"],
            ["invitations.token"],
        ),
        sa.PrimaryKeyConstraint("number"),
        sa.UniqueConstraint("code"),
        sa.UniqueConstraint("session"),
        sqlite_autoincrement=True,
    )
    op.create_index(
        op.f("ix_participants_invitation"), "participants", ["invitation"], unique=False
    )
    op.create_table(
        "identities",
        sa.Column("participant", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("value", sa.String(length=200), nullable=False),
        sa.ForeignKeyConstraint(
            ["participant"],
            ["participants.number"],
        ),
        sa.PrimaryKeyConstraint("participant", "name"),
    )
    op.create_table(
        "questionnaires",
        sa.Column("participant", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("content", sa.Text(), nullable=False),
        sa.Column("received_at", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(
            ["participant"],
            ["participants.number"],
        ),
        sa.PrimaryKeyConstraint("participant", "revision"),
    )
    op.create_table(
        "trials",
        sa.Column("participant", sa.Integer(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("kind", sa.String(length=16), nullable=False),
        sa.Column("query", sa.Integer(), nullable=False),
        sa.Column("first_is_left", sa.Boolean(), nullable=False),
        sa.Column("served_at", sa.Double(), nullable=True),
        sa.Column("watched_at", sa.Double(), nullable=True),
        sa.ForeignKeyConstraint(
            ["participant"],
            ["participants.number"],
        ),
        sa.PrimaryKeyConstraint("participant", "place"),
    )
    op.create_table(
        "answers",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("submission", sa.String(length=36), nullable=False),
        sa.Column("participant", sa.Integer(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("choice", sa.String(length=16), nullable=False),
        sa.Column("good", sa.Integer(), nullable=True),
        sa.Column("bad", sa.Integer(), nullable=True),
        sa.Column("nothing_marked", sa.Boolean(), nullable=False),
        sa.Column("received_at", sa.Double(), nullable=False),
        sa.Column("client_shown_at", sa.Double(), nullable=True),
        sa.Column("client_watched_at", sa.Double(), nullable=True),
        sa.Column("client_chosen_at", sa.Double(), nullable=True),
        sa.Column("client_answered_at", sa.Double(), nullable=True),
        sa.Column("replays", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["participant", "place"],
            ["trials.participant", "trials.place"],
        ),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("participant", "place", "revision"),
        sa.UniqueConstraint("participant", "submission"),
    )
