"""Copy of a ROS 2 recording's sqlite3 file, row by row."""

import sqlite3
from pathlib import Path

from andabata.records.containers.sqlite_file import SqliteFile


def copy_sqlite(source: SqliteFile, target: Path) -> int:
    """Write the readable rows of a recording to a new file with the same tables.

    Args:
        source: Open recording.
        target: Path of a file that does not exist yet.

    Returns:
        Number of messages written.
    """
    database = sqlite3.connect(target)
    try:
        schema = source.database.execute(
            "SELECT name, sql, type = 'table' FROM sqlite_master "
            "WHERE sql IS NOT NULL AND name NOT LIKE 'sqlite_%'"
        ).fetchall()
        for name, sql, is_table in schema:
            if is_table:
                database.execute(sql)
                if name != "messages":
                    _copy_rows(source.database, database, name)
        count = _copy_messages(source, database)
        for _, sql, is_table in schema:
            if not is_table:
                database.execute(sql)
        database.commit()
    finally:
        database.close()
    return count


def _copy_rows(source: sqlite3.Connection, target: sqlite3.Connection, table: str) -> None:
    """Copy all rows of a small table."""
    rows = source.execute(f'SELECT * FROM "{table}"').fetchall()
    for row in rows:
        marks = ",".join("?" * len(row))
        target.execute(f'INSERT INTO "{table}" VALUES({marks})', row)


def _copy_messages(source: SqliteFile, target: sqlite3.Connection) -> int:
    """Copy the readable messages and return their number."""
    query = "SELECT * FROM messages WHERE rowid = ?"
    width = len(source.database.execute("SELECT * FROM messages LIMIT 0").description)
    insert = f"INSERT INTO messages VALUES({','.join('?' * width)})"
    count = 0
    for rowid, *_ in source.rows("topic_id"):
        target.execute(insert, source.database.execute(query, (rowid,)).fetchone())
        count += 1
    return count
