"""Run by Alembic: brings a database to the newest schema, in the transaction that is given."""

from alembic import context

from polite.study.schema import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata)
with context.begin_transaction():
    context.run_migrations()
