"""The tables of a study; `migrations/` brings older databases to this.

Answers are append-only: a changed answer is a row with the next revision. Times are seconds since
the epoch, the server's unless a column says client. Who a person is to a panel stands in a table
of its own, which no export of answers reads.
"""

from __future__ import annotations

from sqlalchemy import (
    Boolean,
    Column,
    Double,
    ForeignKey,
    ForeignKeyConstraint,
    Integer,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
)

metadata = MetaData()

designs = Table(
    "designs",
    metadata,
    Column("sha", String(64), primary_key=True),
    Column("content", Text, nullable=False),  # JSON
    Column("first_used", Double, nullable=False),
)
"""Every design that anybody has taken part in."""

pools = Table("pools", metadata, Column("sha", String(64), primary_key=True))
"""Checksum of the segments and comparisons that answers refer to; one, once anybody takes part."""

invitations = Table(
    "invitations",
    metadata,
    Column("token", String(64), primary_key=True),
    Column("cap", Integer, nullable=False),  # how many people may join by it
    Column("withdrawn", Integer, nullable=False),  # how many of them are not among us any more
    Column("created", Double, nullable=False),
)

participants = Table(
    "participants",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("session", String(64), nullable=False, unique=True),  # SHA-256 of the session's token
    Column("code", String(32), nullable=False, unique=True),  # withdraws
    Column("invitation", ForeignKey("invitations.token"), nullable=False, index=True),
    Column("condition", String(16), nullable=False),
    Column("block", Integer, nullable=False),
    Column("design", ForeignKey("designs.sha"), nullable=False),
    Column("consent_version", Text, nullable=False),
    Column("stage", String(16), nullable=False),
    Column("joined_at", Double, nullable=False),
    Column("last_seen", Double, nullable=False),
    Column("finished_at", Double),
    sqlite_autoincrement=True,  # the number of somebody who withdrew is not given again
)

identities = Table(
    "identities",
    metadata,
    Column("participant", ForeignKey("participants.number"), primary_key=True),
    Column("name", String(64), primary_key=True),  # as in the panel's link: PROLIFIC_PID
    Column("value", String(200), nullable=False),
)
"""What a panel calls a person; needed to pay, never exported with answers."""

trials = Table(
    "trials",
    metadata,
    Column("participant", ForeignKey("participants.number"), primary_key=True),
    Column("place", Integer, primary_key=True),
    Column("kind", String(16), nullable=False),
    Column("query", Integer, nullable=False),
    Column("first_is_left", Boolean, nullable=False),
    Column("served_at", Double),
    Column("watched_at", Double),
)

answers = Table(
    "answers",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=True),
    Column("submission", String(36), nullable=False),
    Column("participant", Integer, nullable=False),
    Column("place", Integer, nullable=False),
    Column("revision", Integer, nullable=False),
    Column("choice", String(16), nullable=False),
    Column("good", Integer),
    Column("bad", Integer),
    Column("nothing_marked", Boolean, nullable=False),
    Column("received_at", Double, nullable=False),
    Column("client_shown_at", Double),
    Column("client_watched_at", Double),
    Column("client_chosen_at", Double),
    Column("client_answered_at", Double),
    Column("replays", Integer, nullable=False),
    ForeignKeyConstraint(["participant", "place"], ["trials.participant", "trials.place"]),
    UniqueConstraint("participant", "place", "revision"),
    UniqueConstraint("participant", "submission"),
)

questionnaires = Table(
    "questionnaires",
    metadata,
    Column("participant", ForeignKey("participants.number"), primary_key=True),
    Column("revision", Integer, primary_key=True),
    Column("content", Text, nullable=False),  # JSON: name -> answer
    Column("received_at", Double, nullable=False),
)

withdrawals = Table(
    "withdrawals",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=True),
    Column("condition", String(16), nullable=False),
    Column("stage", String(16), nullable=False),
    Column("at", Double, nullable=False),
)
"""How many withdrew and when; nothing of theirs."""
