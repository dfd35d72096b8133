"""Which segments and comparisons the answers refer to.

Revision ID: 0002
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Make the table."""
    op.create_table(
        "pools",
        sa.Column("sha", sa.String(length=64), nullable=False),
        sa.PrimaryKeyConstraint("sha"),
    )
